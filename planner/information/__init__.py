"""The campaign by what flies: information of power-ons, what a campaign leaves in flight, the shortest one."""
