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
        (f'share/{package}/config', glob('config/*.yaml')),
        (f'lib/{package}', glob('scripts/*')),
    ],
    entry_points={'khr.nodes': ['knee_controller = khr_example_controller.knee:KNEE_CONTROLLER']},
    package_data={'': ['py.typed']},
    install_requires=['khr_common', 'khr_balance'],
    extras_require={'test': ['pytest']},
)
