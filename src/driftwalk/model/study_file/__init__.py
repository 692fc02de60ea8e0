"""Study files: a study as TOML, and the template with comments."""
