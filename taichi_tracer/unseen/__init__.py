"""What a picture's samples do not know: light that none of them met, for the upper end of its error."""
