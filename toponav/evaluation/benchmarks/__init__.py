"""How fast the parts are: measured on one core, several ways in the same run."""
