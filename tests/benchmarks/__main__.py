"""Run all benchmarks: ``python -m tests.benchmarks``, or ``make bench``."""

from tests.benchmarks import bench_graph, bench_gyro_circuit, bench_models

for bench in (bench_models, bench_gyro_circuit, bench_graph):
    print(f'\n## {bench.__name__.rsplit(".", 1)[-1]}\n')
    bench.main()
