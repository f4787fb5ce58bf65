[(cue) (look) (preview) (part) (surface) (light) (view) (comment)] @fold
