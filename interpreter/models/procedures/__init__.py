"""Procedures: analyses in time of a static model of any discretization, and what they report."""
