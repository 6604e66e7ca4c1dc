!> Classic orbits: Kepler's ellipse, Arenstorf's closed orbit about earth and moon, the seven stars of the Pleiades.
!>
!> The states are the positions of the bodies in a plane, x before y, then their velocities. A source attracts a body with the
!> acceleration mass (source - body) / distance^3.
module nocdyn_classic_orbits
  use nocdyn_classic_problem, only: allocate_ends, classic_problem_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: kepler_problem, arenstorf_problem, pleiades_problem

  !> One body and a mass 1 at rest in the origin.
  type, extends(classic_problem_t), public :: kepler_t
    real(wp) :: mass = 1.0_wp
  contains
    procedure :: law => kepler_law
    procedure :: tangent => kepler_tangent
  end type kepler_t

  !> One body in the frame that turns with the earth at (-moon, 0) and the moon at (1 - moon, 0).
  type, extends(classic_problem_t), public :: arenstorf_t
    real(wp) :: moon = 0.012277471_wp
  contains
    procedure :: law => arenstorf_law
    procedure :: tangent => arenstorf_tangent
  end type arenstorf_t

  !> Seven stars, star i with the mass i: x(1:7), y(1:7), and their velocities.
  type, extends(classic_problem_t), public :: pleiades_t
    integer :: stars = 7
  contains
    procedure :: law => pleiades_law
    procedure :: tangent => pleiades_tangent
  end type pleiades_t

contains

  !> mass d / |d|^3
  pure function pull(mass, d)
    real(wp), intent(in) :: mass
    real(wp), intent(in) :: d(2)   !! from the body to the source
    real(wp) :: pull(2)

    pull = mass / (d(1)**2 + d(2)**2)**1.5_wp * d
  end function pull

  !> Derivatives of `pull` by the position of the body: xx, xy, yy.
  pure function pull_slopes(mass, d) result(slopes)
    real(wp), intent(in) :: mass
    real(wp), intent(in) :: d(2)
    real(wp) :: slopes(3)
    real(wp) :: square

    square = d(1)**2 + d(2)**2
    slopes = mass / square**2.5_wp * [3 * d(1)**2 - square, 3 * d(1) * d(2), 3 * d(2)**2 - square]
  end function pull_slopes

  !> Eccentricity 0.9, from the near point through 3.2 revolutions.
  function kepler_problem() result(problem)
    type(kepler_t) :: problem
    real(wp), parameter :: eccentricity = 0.9_wp

    call allocate_ends(problem, 4)
    problem%name = 'Kepler, e = 0.9'
    problem%source = 'Enright and Pryce 1987, NSDTST, D5'
    problem%t_end = 20.0_wp
    problem%rodas_steps = 368
    problem%error_factor = 3000.0_wp
    problem%rounding = 1.0e-12_wp
    problem%published_error = 1.0e-14_wp
    problem%y_start = [1 - eccentricity, 0.0_wp, 0.0_wp, sqrt((1 + eccentricity) / (1 - eccentricity))]
    problem%published = [-1.295266250987574_wp, 0.4003938963792321_wp, -0.6775390924707566_wp, -0.1270838154278686_wp]
    problem%y_end = [-1.29526625098758851_wp, 0.400393896379229108_wp, &
                     -0.677539092470745216_wp, -0.127083815427872297_wp]
  end function kepler_problem

  subroutine kepler_law(self, y, dydt)
    class(kepler_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)

    dydt(1:2) = y(3:4)
    dydt(3:4) = pull(self%mass, -y(1:2))
  end subroutine kepler_law

  subroutine kepler_tangent(self, y, dfdy)
    class(kepler_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp) :: slopes(3)

    slopes = pull_slopes(self%mass, -y(1:2))
    dfdy(1, 1:4) = [0.0_wp, 0.0_wp, slopes(1), slopes(2)]
    dfdy(1, 5:8) = [0.0_wp, 0.0_wp, slopes(2), slopes(3)]
    dfdy(1, 9:12) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    dfdy(1, 13:16) = [0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]
  end subroutine kepler_tangent

  !> One period of the closed orbit. It starts close to the moon and approaches it again, so that errors grow.
  function arenstorf_problem() result(problem)
    type(arenstorf_t) :: problem

    call allocate_ends(problem, 4)
    problem%name = 'Arenstorf'
    problem%source = 'Hairer, Norsett and Wanner, Solving ODEs I, section II.0: the orbit closes'
    problem%t_end = 17.0652165601579625588917206249_wp
    problem%rodas_steps = 277
    problem%error_factor = 2.0e5_wp
    problem%rounding = 1.0e-9_wp
    problem%published_error = 2.0e-11_wp
    problem%y_start = [0.994_wp, 0.0_wp, 0.0_wp, -2.00158510637908252240537862224_wp]
    problem%published = problem%y_start
    problem%y_end = [0.993999999999973996_wp, -8.85513462011753429e-14_wp, &
                     -1.43886673573122611e-11_wp, -2.00158510638312902_wp]
  end function arenstorf_problem

  subroutine arenstorf_law(self, y, dydt)
    class(arenstorf_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)

    dydt(1:2) = y(3:4)
    dydt(3:4) = [y(1) + 2 * y(4), y(2) - 2 * y(3)] &
      + pull(1 - self%moon, [-self%moon - y(1), -y(2)]) + pull(self%moon, [1 - self%moon - y(1), -y(2)])
  end subroutine arenstorf_law

  subroutine arenstorf_tangent(self, y, dfdy)
    class(arenstorf_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp) :: slopes(3)

    slopes = pull_slopes(1 - self%moon, [-self%moon - y(1), -y(2)]) &
      + pull_slopes(self%moon, [1 - self%moon - y(1), -y(2)])
    dfdy(1, 1:4) = [0.0_wp, 0.0_wp, 1 + slopes(1), slopes(2)]
    dfdy(1, 5:8) = [0.0_wp, 0.0_wp, slopes(2), 1 + slopes(3)]
    dfdy(1, 9:12) = [1.0_wp, 0.0_wp, 0.0_wp, -2.0_wp]
    dfdy(1, 13:16) = [0.0_wp, 1.0_wp, 2.0_wp, 0.0_wp]
  end subroutine arenstorf_tangent

  !> Quasi-collisions make the step sizes change a lot.
  function pleiades_problem() result(problem)
    type(pleiades_t) :: problem

    call allocate_ends(problem, 28)
    problem%name = 'Pleiades'
    problem%source = 'Mazzia and Magherini, Test Set for IVP Solvers 2.4, PLEI'
    problem%t_end = 3.0_wp
    problem%rodas_steps = 356
    problem%finest = 11
    problem%error_factor = 1.0e4_wp
    problem%rounding = 1.0e-11_wp
    problem%y_start(1:7) = [3.0_wp, 3.0_wp, -1.0_wp, -3.0_wp, 2.0_wp, -2.0_wp, 2.0_wp]
    problem%y_start(8:14) = [3.0_wp, -3.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, -4.0_wp, 4.0_wp]
    problem%y_start([20, 21, 25, 26]) = [1.75_wp, -1.5_wp, -1.25_wp, 1.0_wp]
    problem%published = [ &
      0.3706139143970502_wp, 3.237284092057233_wp, -3.222559032418324_wp, 0.6597091455775310_wp, &
      0.3425581707156584_wp, 1.562172101400631_wp, -0.7003092922212495_wp, -3.943437585517392_wp, &
      -3.271380973972550_wp, 5.225081843456543_wp, -2.590612434977470_wp, 1.198213693392275_wp, &
      -0.2429682344935824_wp, 1.091449240428980_wp, 3.417003806314313_wp, 1.354584501625501_wp, &
      -2.590065597810775_wp, 2.025053734714242_wp, -1.155815100160448_wp, -0.8072988170223021_wp, &
      0.5952396354208710_wp, -3.741244961234010_wp, 0.3773459685750630_wp, 0.9386858869551073_wp, &
      0.3667922227200571_wp, -0.3474046353808490_wp, 2.344915448180937_wp, -1.947020434263292_wp]
    problem%y_end = [ &
      0.370613914397051290_wp, 3.23728409205723309_wp, -3.22255903241832335_wp, 0.659709145577530836_wp, &
      0.342558170715657979_wp, 1.56217210140063102_wp, -0.700309292221249539_wp, -3.94343758551739206_wp, &
      -3.27138097397254993_wp, 5.22508184345654419_wp, -2.59061243497746951_wp, 1.19821369339227464_wp, &
      -0.242968234493582341_wp, 1.09144924042897975_wp, 3.41700380631431475_wp, 1.35458450162550122_wp, &
      -2.59006559781077542_wp, 2.02505373471424111_wp, -1.15581510016044909_wp, -0.807298817022302173_wp, &
      0.595239635420871877_wp, -3.74124496123400847_wp, 0.377345968575062904_wp, 0.938685886955107889_wp, &
      0.366792222720056987_wp, -0.347404635380849437_wp, 2.34491544818093692_wp, -1.94702043426329190_wp]
  end function pleiades_problem

  subroutine pleiades_law(self, y, dydt)
    class(pleiades_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)
    real(wp) :: total(2)
    integer :: i, j

    associate (n => self%stars)
      dydt(:2 * n) = y(2 * n + 1:)
      do i = 1, n
        total = 0.0_wp
        do j = 1, n
          if (j /= i) total = total + pull(real(j, wp), [y(j) - y(i), y(n + j) - y(n + i)])
        end do
        dydt(2 * n + i) = total(1)
        dydt(3 * n + i) = total(2)
      end do
    end associate
  end subroutine pleiades_law

  subroutine pleiades_tangent(self, y, dfdy)
    class(pleiades_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp) :: slopes(3)
    integer :: i, j

    dfdy = 0.0_wp
    associate (n => self%stars)
      do i = 1, 2 * n
        dfdy(1, i + (2 * n + i - 1) * 4 * n) = 1.0_wp
      end do
      do i = 1, n
        do j = 1, n
          if (j == i) cycle
          slopes = pull_slopes(real(j, wp), [y(j) - y(i), y(n + j) - y(n + i)])
          call add_slopes(n, i, i, slopes, dfdy)
          call add_slopes(n, i, j, -slopes, dfdy)
        end do
      end do
    end associate
  end subroutine pleiades_tangent

  !> Adds the derivatives of the acceleration of star `row` by the position of star `column`.
  pure subroutine add_slopes(stars, row, column, slopes, dfdy)
    integer, intent(in) :: stars, row, column
    real(wp), intent(in) :: slopes(3)
    real(wp), intent(inout) :: dfdy(4 * stars, 4 * stars)

    dfdy(2 * stars + row, column) = dfdy(2 * stars + row, column) + slopes(1)
    dfdy(2 * stars + row, stars + column) = dfdy(2 * stars + row, stars + column) + slopes(2)
    dfdy(3 * stars + row, column) = dfdy(3 * stars + row, column) + slopes(2)
    dfdy(3 * stars + row, stars + column) = dfdy(3 * stars + row, stars + column) + slopes(3)
  end subroutine add_slopes

end module nocdyn_classic_orbits
