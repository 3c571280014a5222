from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package = 'khr_analysis'
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
    entry_points={
        'khr.nodes': [
            'fft_analyser = khr_analysis.node_specs:FFT_ANALYSER',
            'monitor = khr_analysis.node_specs:MONITOR',
            'recorder = khr_analysis.node_specs:RECORDER',
        ]
    },
    package_data={'': ['py.typed']},
    install_requires=['khr_common', 'numpy', 'rosbags', 'scipy'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer=manifest.findtext('maintainer'),
    maintainer_email=manifest.find('maintainer').get('email'),
    url=manifest.findtext('url'),
    description=manifest.findtext('description'),
    license=manifest.findtext('license'),
)
