"""Parts of the joint estimate: rows of the points, of the robot, of what is not round, and their solution."""
