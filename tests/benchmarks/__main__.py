"""Run all benchmarks: ``python -m tests.benchmarks``, or ``make bench``.

The options are those of bench_graph; ``--write docs/performance.md`` writes its report.
"""

from tests.benchmarks import bench_graph, bench_gyro_circuit, bench_models

for bench in (bench_models, bench_gyro_circuit, bench_graph):
    print(f'\n## {bench.__name__.rsplit(".", 1)[-1]}\n')
    bench.main()
