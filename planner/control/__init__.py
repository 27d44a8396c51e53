"""What benches are told, how axes move, what can be done: for runner, simulator and exports alike."""
