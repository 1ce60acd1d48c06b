"""Number types beyond float: lanes (the nodes of a blade, eight at a time) and duals (a value with derivatives)."""
