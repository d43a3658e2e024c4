"""What a ray shows: surface views, direct light, RT3's pictures. ``base`` states the interface."""
