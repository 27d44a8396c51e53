"""One file a format in which a plan leaves."""
