from glob import glob

from setuptools import find_packages, setup

package = 'khr_balance'
setup(
    name=package,
    version='0.1.0',
    packages=find_packages(include=[package, f'{package}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        (f'lib/{package}', glob('scripts/*')),
    ],
    package_data={'': ['py.typed']},
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer='khr developers',
    maintainer_email='maintainers@khr.invalid',
    description='Gait and feedback controllers for the KONDO KHR-3HV',
    license='Apache-2.0',
)
