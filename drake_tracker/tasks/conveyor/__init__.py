"""The task of the conveyor: pick parts from a moving belt, and put them into the cells of trays."""
