"""The track of a robot under a camera: the video, the lens, the camera's place, and the tags in each picture."""
