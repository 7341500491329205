"""What every room uses: text, numbers, values and types of the AutoMax languages, integer time, diagnostics, YAML."""
