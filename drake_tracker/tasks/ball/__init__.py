"""The ball of Nashman and Chaconas 1990: one camera, a board of pegs, and an arm that catches the ball."""
