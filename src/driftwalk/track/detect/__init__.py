"""Detectors of objects in one frame: two-colour markers, tags and blobs."""
