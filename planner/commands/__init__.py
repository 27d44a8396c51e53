"""The commands, one file a family, no arithmetic: read arguments, call a pipeline, write what comes back."""
