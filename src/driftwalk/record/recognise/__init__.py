"""Names in a file, and the formats that have most of them."""
