"""What problems ask of segments: ways of the tool with their stops, and limits that belong to single segments."""
