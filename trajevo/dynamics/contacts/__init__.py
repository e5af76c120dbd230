"""What a moving robot asks of its contacts: forces on the payload and on its stand, and how its joints give way."""
