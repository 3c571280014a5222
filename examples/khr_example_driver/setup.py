from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package = 'khr_example_driver'
manifest = ElementTree.parse('package.xml')
setup(
    name=package,
    version=manifest.findtext('version'),
    packages=find_packages(include=[package, f'{package}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        (f'lib/{package}', glob('scripts/*')),
    ],
    install_requires=[],
    zip_safe=True,
    maintainer=manifest.findtext('maintainer'),
    maintainer_email=manifest.find('maintainer').get('email'),
    description=manifest.findtext('description'),
    license=manifest.findtext('license'),
)
