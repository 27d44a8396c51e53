"""A rate table and a thermal chamber to try a campaign on: strict languages, a virtual clock."""
