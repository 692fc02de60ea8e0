"""Does the model explain the recording? The check of a likelihood fit."""
