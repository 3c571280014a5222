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
    ],
    entry_points={'console_scripts': ['khr = khr.cli.command:main']},
    package_data={'': ['py.typed']},
    install_requires=[
        'khr_common',
        'khr_description',
        'khr_sim',
        'khr_balance',
        'khr_analysis',
        'khr_hardware',
        'khr_bringup',
        'khr_sweeps',
        'khr_view',
        'khr_report',
        'khr_studies',
        'gymnasium',
        'matplotlib',
        'numpy',
        'pyarrow',
        'pydantic',
        'rich',
        'typer',
    ],
    extras_require={
        'pettingzoo': ['pettingzoo'],
        'test': ['hypothesis', 'pytest', 'pytest-timeout'],
    },
)
