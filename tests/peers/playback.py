"""One frame from four key images by OpenCV and numpy, one thread: name and processor milliseconds.

    python3 playback.py WIDTH HEIGHT

Called by `cargo bench --bench playback`. OpenCV blends as the paper's hardware did, by three
addWeighted; in 8 bits that is a frame as displayed (and wrong in light), in f32 it is light still
without exposure, curve or display code, and so is numpy's `weights @ stack`.
"""
import os
import sys
import time

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
import cv2

cv2.setNumThreads(1)
width, height = int(sys.argv[1]), int(sys.argv[2])
random = np.random.default_rng(1)


def typical(frame, turns=8):
    times = []
    for _ in range(turns):
        begin = time.thread_time()
        frame()
        times.append(time.thread_time() - begin)
    return 1e3 * sorted(times)[len(times) // 2]


for name, kind, most in [("f32", np.float32, 4.0), ("8-bit", np.uint8, 255.0)]:
    keys = [(random.random((height, width, 3)) * most).astype(kind) for _ in range(4)]
    first, second, out = (np.empty_like(keys[0]) for _ in range(3))

    def three():
        cv2.addWeighted(keys[0], 0.37, keys[1], 0.63, 0.0, first)
        cv2.addWeighted(keys[2], 0.86, keys[3], 0.14, 0.0, second)
        cv2.addWeighted(first, 0.69, second, 0.31, 0.0, out)

    print(f"OpenCV addWeighted {name} {typical(three):.3f}")

for count, what in [(4, "4 keys"), (22, "22 banks")]:
    stack = random.random((count, height * width * 3), dtype=np.float32)
    weights = np.full(count, 1.0 / count, dtype=np.float32)
    out = np.empty(height * width * 3, dtype=np.float32)
    print(f"numpy weights @ stack, {what} {typical(lambda: np.matmul(weights, stack, out=out)):.3f}")
