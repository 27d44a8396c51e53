"""What is said of each result, one file a subject: results in, a report of blocks out."""
