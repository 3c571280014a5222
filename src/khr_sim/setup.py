from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

manifest = ElementTree.parse('package.xml')
package = manifest.findtext('name')
stated = ('name', 'version', 'description', 'license', 'maintainer', 'url')
setup(
    **{key: manifest.findtext(key) for key in stated},
    maintainer_email=manifest.find('maintainer').get('email'),
    packages=find_packages(),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        (f'lib/{package}', glob('scripts/*')),
    ],
    entry_points={
        'khr.nodes': [
            'simulator = khr_sim.run_parameters:SIMULATOR',
            'gyro = khr_sim.sensors:GYRO',
            'foot_force = khr_sim.sensors:FOOT_FORCE',
            'transforms = khr_sim.transforms:TRANSFORMS',
        ]
    },
    package_data={'': ['py.typed']},
    install_requires=[
        'khr_common',
        'khr_description',
        'khr_models',
        'llvmlite',
        'numba',
        'numpy',
        'pybullet; python_version < "3.12"',
    ],
    extras_require={'mujoco': ['mujoco<4'], 'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
