"""What is drawn, one file a subject: results in, pictures out; nothing is drawn before a page is made."""
