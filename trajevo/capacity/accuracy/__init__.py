"""What an arm carries under all limits at once: of drives, of accuracy, of its grip, and of what it stands on."""
