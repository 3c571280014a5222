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
            'gait = khr_balance.gaits.gait:GAIT',
            'stage = khr_balance.stage:STAGE_NODE',
            'ankle_controller = khr_balance.controllers:ANKLE_CONTROLLER',
            'hip_controller = khr_balance.controllers:HIP_CONTROLLER',
            'roll_controller = khr_balance.controllers:ROLL_CONTROLLER',
            'recovery = khr_balance.recovery.recovery:RECOVERY',
        ]
    },
    package_data={'': ['py.typed']},
    install_requires=['khr_common', 'khr_description', 'numpy', 'pyyaml'],
    extras_require={'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
