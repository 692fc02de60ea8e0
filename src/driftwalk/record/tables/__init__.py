"""Tables of any origin: text, workbooks, MATLAB files and columns in memory, by one set of rules."""
