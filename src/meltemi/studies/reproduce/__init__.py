"""Published studies, done again from their own set-up and compared claim by claim."""
