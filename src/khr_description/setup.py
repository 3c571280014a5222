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
        *(
            (f'share/{package}/{folder}', glob(f'{folder}/*'))
            for folder in ('launch', 'rviz', 'urdf')
        ),
    ],
    package_data={'': ['py.typed', 'urdf/*.urdf']},
    install_requires=['khr_common', 'numpy'],
    extras_require={'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
