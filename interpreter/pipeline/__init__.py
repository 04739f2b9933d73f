"""The pipeline: from a text to its report. Imports rooms up to the evidence.

pipeline     every step in order, one function
options      what a run is told, and what it starts from
answers      what it has found so far
kept, taken  what is kept of an earlier run, and taking it over
probes, models, references, reports  the steps
environment  what a report says of its scene and of the machine
"""
