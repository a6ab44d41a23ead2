"""From light to tracks: frames, detectors, tracker, a moving camera held still. The only place that imports cv2."""
