"""Tables of text, workbooks, MATLAB files and columns in memory, read by one set of rules."""
