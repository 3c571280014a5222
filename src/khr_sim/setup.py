from glob import glob

from setuptools import find_packages, setup

package = 'khr_sim'
setup(
    name=package,
    version='0.1.0',
    packages=find_packages(include=[package, f'{package}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        (f'share/{package}/urdf', glob('urdf/*')),
        (f'lib/{package}', glob('scripts/*')),
    ],
    package_data={'': ['py.typed', 'urdf/*.urdf']},
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer='khr developers',
    maintainer_email='maintainers@khr.invalid',
    description='A PyBullet simulator of the KONDO KHR-3HV, its foot-force sensors and its gyro',
    license='Apache-2.0',
)
