"""From results to what widgets draw: pure functions, plain arrays, nothing of Qt or VTK.

The camera of a fitted body looks at metres and radians here; millimetres and degrees appear where a name says so.
"""
