from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package = 'khr_bringup'
manifest = ElementTree.parse('package.xml')
setup(
    name=package,
    version=manifest.findtext('version'),
    packages=find_packages(include=[package, f'{package}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        (f'lib/{package}', glob('scripts/*')),
        (f'share/{package}/launch', glob('launch/*')),
        *(
            (f'share/{package}/config/{folder}', glob(f'{package}/config/{folder}/*.*'))
            for folder in ('', 'scenarios', 'sweeps', 'experiments')
        ),
        (f'share/{package}/config/view', glob(f'{package}/config/view/*')),
    ],
    package_data={
        '': [
            'py.typed',
            '*.xml',
            'config/*.json',
            'config/*.yaml',
            'config/*/*.yaml',
            'config/view/*',
        ]
    },
    install_requires=[
        'khr_common',
        'khr_sim',
        'khr_balance',
        'khr_analysis',
        'numpy',
        'PyYAML',
        'rich',
        'rosbags',
    ],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer=manifest.findtext('maintainer'),
    maintainer_email=manifest.find('maintainer').get('email'),
    url=manifest.findtext('url'),
    description=manifest.findtext('description'),
    license=manifest.findtext('license'),
)
