"""Run all benchmarks: ``python -m tests.benchmarks``, or ``make bench``.

The options are those of bench_graph; ``--write docs/performance.md`` writes its report.
"""

import sys

from tests.benchmarks import bench_graph, bench_gyro_circuit, bench_models

arguments = sys.argv[1:]
for bench, own in ((bench_models, []), (bench_gyro_circuit, []), (bench_graph, arguments)):
    print(f'\n## {bench.__name__.rsplit(".", 1)[-1]}\n')
    sys.argv[1:] = own
    bench.main()
