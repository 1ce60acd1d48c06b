"""Numbers from results: statistics, fatigue, files."""
