"""Load surrogates: designs of site conditions, their runs, fits, and the loads of sites from them."""
