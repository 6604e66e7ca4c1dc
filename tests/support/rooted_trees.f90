!> Rooted trees and the conditions of order that belong to them: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary
!> Differential Equations I, II.2, and E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.7.
!>
!> A method with the weights b is of order p if sum b_i phi_i(t) = 1 / density(t) for every tree t with up to p vertices,
!> and y(t + theta h) of order p inside the step if sum b_i(theta) phi_i(t) = theta^order(t) / density(t).
module nocdyn_rooted_trees
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: rooted_trees, stage_products, largest_defects

  !> A tree is the tree `stem` with the tree `branch` planted on its root; neither exists for the single vertex, the
  !> first tree. The branches of a tree are planted in the order of their indices, so that no tree occurs twice.
  type, public :: rooted_tree_t
    integer :: order = 1            !! number of vertices
    integer :: stem = 0
    integer :: branch = 0
    real(wp) :: density = 1.0_wp
  end type rooted_tree_t

contains

  !> All trees with up to `highest` vertices, by rising order.
  pure function rooted_trees(highest) result(trees)
    integer, intent(in) :: highest
    type(rooted_tree_t), allocatable :: trees(:)
    integer :: order, stem, branch

    allocate (trees(1))
    do order = 2, highest
      do stem = 1, size(trees)
        do branch = max(1, trees(stem)%branch), size(trees)
          if (trees(stem)%order + trees(branch)%order == order) trees = [trees, planted(trees, stem, branch)]
        end do
      end do
    end do
  end function rooted_trees

  pure function planted(trees, stem, branch) result(tree)
    type(rooted_tree_t), intent(in) :: trees(:)
    integer, intent(in) :: stem, branch
    type(rooted_tree_t) :: tree

    tree%order = trees(stem)%order + trees(branch)%order
    tree%stem = stem
    tree%branch = branch
    tree%density = tree%order * trees(branch)%density * trees(stem)%density / trees(stem)%order
  end function planted

  !> phi_i(t) of every stage i and tree t, shape [stages, trees]: the product over the branches u at the root of t of
  !> sum_j x_ij phi_j(u), where x is `alpha`, but `beta` if the root has a single branch. For Rosenbrock methods `beta` is
  !> alpha_ij + gamma_ij: J k_j adds to f'(y) applied to one tree alone. For Runge-Kutta methods both are a.
  pure function stage_products(trees, alpha, beta) result(phi)
    type(rooted_tree_t), intent(in) :: trees(:)
    real(wp), intent(in) :: alpha(:, :)
    real(wp), intent(in) :: beta(:, :)
    real(wp), allocatable :: phi(:, :)
    real(wp) :: products(size(alpha, 1), size(trees))   !! with alpha at the root, whatever the number of branches
    integer :: tree

    allocate (phi(size(alpha, 1), size(trees)), source=1.0_wp)
    products = 1.0_wp
    do tree = 2, size(trees)
      associate (stem => trees(tree)%stem, branch => trees(tree)%branch)
        products(:, tree) = products(:, stem) * matmul(alpha, phi(:, branch))
        phi(:, tree) = products(:, tree)
        if (stem == 1) phi(:, tree) = matmul(beta, phi(:, branch))
      end associate
    end do
  end function stage_products

  !> The largest |sum b_i(theta) phi_i(t) - theta^order(t) / density(t)| among the trees t of each order.
  pure function largest_defects(trees, phi, weights, theta) result(largest)
    type(rooted_tree_t), intent(in) :: trees(:)
    real(wp), intent(in) :: phi(:, :)         !! of `stage_products`
    real(wp), intent(in) :: weights(:)        !! of the first stages; further ones have none
    real(wp), intent(in) :: theta             !! 1 for the result of the step
    real(wp), allocatable :: largest(:)       !! shape [highest order]
    real(wp) :: defect
    integer :: tree

    allocate (largest(maxval(trees%order)), source=0.0_wp)
    do tree = 1, size(trees)
      associate (order => trees(tree)%order)
        defect = abs(sum(weights * phi(:size(weights), tree)) - theta**order / trees(tree)%density)
        largest(order) = max(largest(order), defect)
      end associate
    end do
  end function largest_defects

end module nocdyn_rooted_trees
