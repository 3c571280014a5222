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
    entry_points={'khr.nodes': ['board = khr_hardware.parameters:BOARD']},
    package_data={'': ['py.typed', 'maps/*.yaml']},
    install_requires=['khr_common', 'pyserial'],
    extras_require={'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
