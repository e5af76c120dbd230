"""How objects show themselves where somebody looks: one line of text, or a little HTML in a notebook."""
