"""The flows, one file a flow, each a short list of stage calls."""
