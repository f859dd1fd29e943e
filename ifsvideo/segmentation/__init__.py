"""In-frame shear: one stage a file, in the order they run."""
