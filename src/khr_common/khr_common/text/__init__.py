"""Text for a person: Markdown, quoted values."""
