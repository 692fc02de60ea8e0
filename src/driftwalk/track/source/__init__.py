"""Where frames come from: videos, folders of images, live cameras."""
