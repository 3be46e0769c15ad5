"""Simplifies a binary PLY file with the Python package fast-simplification.

usage: fast_simplification.py IN.ply OUT.ply TRIANGLES

Prints a JSON object about it.
"""

import json
import resource
import sys
import time

import fast_simplification
import numpy as np

FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def read(path):
    with open(path, "rb") as file:
        counts = {}
        while (line := file.readline().split()) != [b"end_header"]:
            if line[0] == b"element":
                counts[line[1]] = int(line[2])
        positions = np.frombuffer(file.read(12 * counts[b"vertex"]), "<f4").reshape(-1, 3)
        faces = np.frombuffer(file.read(13 * counts[b"face"]), FACE)["corners"]
    return positions.copy(), faces.copy()


def write(path, positions, triangles):
    faces = np.empty(len(triangles), FACE)
    faces["count"], faces["corners"] = 3, triangles
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(positions)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(np.asarray(positions, "<f4").tobytes())
        file.write(faces.tobytes())


positions, triangles = read(sys.argv[1])
begin = time.process_time()
positions, triangles = fast_simplification.simplify(positions, triangles, target_count=int(sys.argv[3]))
seconds = time.process_time() - begin
write(sys.argv[2], positions, triangles)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
print(json.dumps({"seconds_cpu": seconds, "peak_rss_bytes": peak}))
