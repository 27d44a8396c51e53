"""The campaign by what flies: what power-ons tell, what is left in flight, the shortest one."""
