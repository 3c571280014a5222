from glob import glob

from setuptools import find_packages, setup

package = 'khr_bringup'
setup(
    name=package,
    version='0.1.0',
    packages=find_packages(include=[package, f'{package}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        (f'share/{package}/launch', glob('launch/*')),
        (f'share/{package}/config', glob('khr_bringup/config/*.yaml')),
        (f'share/{package}/config/sweeps', glob('khr_bringup/config/sweeps/*.yaml')),
        (f'share/{package}/config/experiments', glob('khr_bringup/config/experiments/*.yaml')),
    ],
    entry_points={'console_scripts': ['khr = khr_bringup.command:main']},
    package_data={'': ['py.typed', '*.mplstyle', 'templates/*', '*.xml', 'config/*.yaml',
                      'config/sweeps/*.yaml', 'config/experiments/*.yaml']},
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer='khr developers',
    maintainer_email='maintainers@khr.invalid',
    description='Scenarios, launch files and the khr command',
    license='Apache-2.0',
)
