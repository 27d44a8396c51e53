"""The spec: YAML → values with places → a frozen typed spec; all faults at once."""
