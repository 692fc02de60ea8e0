"""What is seen in one frame: two-colour markers, tags and blobs."""
