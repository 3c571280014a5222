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
        (f'share/{package}/launch', glob('launch/*')),
        *(
            (f'share/{package}/config/{folder}', glob(f'{package}/config/{folder}/*.*'))
            for folder in ('', 'bouts', 'motions', 'robots', 'scenarios', 'sweeps', 'experiments')
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
        'khr_description',
        'khr_sim',
        'khr_balance',
        'khr_analysis',
        'khr_hardware',
        'mcap',
        'numpy',
        'PyYAML',
        'rich',
        'rosbags',
        'scipy',
        'zstandard',
    ],
    extras_require={'test': ['hypothesis', 'pytest', 'pytest-timeout']},
)
