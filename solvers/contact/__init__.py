"""Contact: rigid shapes by the gap to their surface, where they are, and what a gap costs."""
