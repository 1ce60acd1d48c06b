"""Design loads: load bases after IEC 61400-1, their evaluation, and surrogates of loads."""
