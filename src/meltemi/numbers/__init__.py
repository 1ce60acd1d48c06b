"""Number types besides floats: lanes (eight nodes of a blade at a time) and duals (a value with derivatives)."""
