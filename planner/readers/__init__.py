"""Readers of raw recordings, one file a format: bytes in, blocks of named columns out, in bounded memory."""
