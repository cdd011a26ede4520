"""The published method: Milef, Keyser and Kong (2024), "Towards Unstructured Unlabeled Optical Mocap: A Video Helps!".

Faithful to the text of the paper, section by section; where the text is silent, to what its authors' program is known
to do, which the docstrings then say. It stands beside the default method for comparison.
"""
