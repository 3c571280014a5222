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
            'fft_analyser = khr_analysis.spectrum:FFT_ANALYSER',
            'monitor = khr_analysis.outcome:MONITOR',
            'run_phase = khr_analysis.run_phase:RUN_PHASE',
            'referee = khr_analysis.referee:REFEREE',
            'recorder = khr_analysis.recorder_parameters:RECORDER',
        ]
    },
    package_data={'': ['py.typed']},
    install_requires=['khr_common', 'mcap', 'numpy', 'PyYAML', 'rosbags', 'scipy'],
    extras_require={'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
