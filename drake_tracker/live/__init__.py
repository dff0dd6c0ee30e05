"""The live view: a page on this machine's loopback that shows a run as it goes on, and holds it when asked to.

It stands outside of the loop: it reads output ports, truth as well, and nothing it knows goes back into the diagram.
"""
