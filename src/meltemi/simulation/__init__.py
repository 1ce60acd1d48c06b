"""The coupled machine in time: model, step, trim, results."""
