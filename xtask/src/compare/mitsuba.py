"""Renders a scene file of Mitsuba 3 and writes its pixels as floats, row by row: mitsuba.py SCENE.xml PIXELS.f32"""

import json
import sys
import time

import mitsuba
import numpy

# Runs everywhere; the faster variants need a library of LLVM or a GPU.
mitsuba.set_variant("scalar_rgb")
# Progress would be on standard output, before the answer.
mitsuba.set_log_level(mitsuba.LogLevel.Error)
scene = mitsuba.load_file(sys.argv[1])
start = time.perf_counter()
pixels = numpy.array(mitsuba.render(scene))
seconds = time.perf_counter() - start
pixels.astype("<f4").tofile(sys.argv[2])
print(json.dumps({"seconds": seconds, "version": mitsuba.__version__}))
